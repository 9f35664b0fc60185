"""The record lives in `twbal.diagnosis`."""

from twbal.diagnosis import Diagnosis as Diagnosis
from twbal.diagnosis import Estimate as Estimate
from twbal.diagnosis import Gap as Gap
from twbal.diagnosis import NamedEffect as NamedEffect
from twbal.diagnosis import Region as Region
from twbal.diagnosis import Rival as Rival
from twbal.diagnosis import Shift as Shift
from twbal.diagnosis import Verdict as Verdict
from twbal.diagnosis import Whiteness as Whiteness
