"""Asks a person for the values of a robot's sheet, one after the other; each answer is checked and kept at once."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from twbal.core.errors import ConfigError
from twbal.core.robot_sheet import ValueProvenance, check_body
from twbal.sheets.answer import Answer, answered, needed, question_of, way_of
from twbal.sheets.questions import QUESTIONS, VALUES, Question, Way

Ask = Callable[[str], str]
"""Shows a prompt, and returns what is typed."""

HELP = "?"
"""Typed in place of an answer: how to find it."""


BACK = "back"
"""Typed in place of an answer: to the question before. The name of an earlier question opens that one."""


class _OpenedError(Exception):
    """An earlier question is opened again.

    Args:
        key: of that question.
    """

    def __init__(self, key: str) -> None:
        super().__init__(key)
        self.key = key


class Person(NamedTuple):
    """Who answers.

    Attributes:
        ask: for one line; None: nobody is there, and all answers must have been given.
        tell: shows a line.
        keep: all answers so far, after each.
    """

    ask: Ask | None
    tell: Callable[[str], None]
    keep: Callable[[Mapping[str, str]], None]


class Interview:
    """The answers of one robot, and what they come to.

    Args:
        name: of the robot.
        texts: answers that are there already, by question.
        person: who answers the others.

    Attributes:
        texts: all answers.
        found: what they come to, by question.
    """

    def __init__(self, name: str, texts: Mapping[str, str], person: Person) -> None:
        self.texts = {question_of(key).key: text for key, text in texts.items()}
        self.found: dict[str, Answer] = {}
        self._name, self._person = name, person
        self._missing: list[str] = []
        self._open: list[str] = []  # the question that is asked, and those that it is asked for
        self._shown: set[str] = set()

    def run(self) -> dict[str, Answer]:
        """The values of the sheet.

        Raises:
            ConfigError: nobody is there to correct an answer, or to give one that is missing.
        """
        while True:
            try:
                for question in VALUES:
                    self._settle(question)
                break
            except _OpenedError as opened:  # all is gone through anew, as other values may rest on it
                self.texts.pop(opened.key, None)
                self.found, self._open = {}, []
        if self._missing:
            raise ConfigError(
                f"The sheet of {self._name} lacks {', '.join(self._missing)}. Run this in a terminal to be asked, or "
                "give each as given.<name>=... or in the file of answers=...; `twbal new-robot --help` has them all."
            )
        return {question.key: self.found[question.key] for question in VALUES}

    @property
    def _known(self) -> dict[str, float]:
        return {key: answer.value for key, answer in self.found.items()}

    def _settle(self, question: Question) -> None:
        """Find a value: of an answer that is there, or by asking until one is good."""
        self._open.append(question.key)
        while question.key not in self.found:
            text = self.texts.get(question.key)
            if text is None and (text := self._asked(question)) is None:
                self._missing.append(question.key)
                break
            try:
                way = way_of(question, text)
                if way is not None:
                    self._keep(question, text)
                    if not self._prepare(way):
                        break
                answer = answered(question, text, self._known)
                check_body(self._name, {**self._known, question.key: answer.value})
            except ConfigError as error:
                self.texts.pop(question.key, None)
                if self._person.ask is None:
                    raise
                self._person.tell(str(error))
                self._forget(way_of(question, text))
                if self.found:
                    self._person.tell(
                        f"To change an earlier answer, type its name, as {next(iter(self.found))}, or {BACK}."
                    )
                continue
            self.found[question.key] = answer
            self._keep(question, text)
            said = f"{question.key} = {answer.value:.6g} {question.unit}: {answer.source}"
            if way is not None and said not in self._shown:
                self._shown.add(said)
                self._person.tell(said)
        self._open.pop()

    def _keep(self, question: Question, text: str) -> None:
        self.texts[question.key] = text
        self._person.keep(self.texts)

    def _prepare(self, way: Way) -> bool:
        """Have what a way needs answered; whether all of it was."""
        for key in needed(way, self._known):
            if key not in self._missing:
                self._settle(QUESTIONS[key])
        return not needed(way, self._known)

    def _forget(self, way: Way | None) -> None:
        """Ask anew for what a way needs beyond values of the sheet, as it came to what cannot be."""
        for key in () if way is None else way.needs:
            if QUESTIONS[key] not in VALUES:
                self.found.pop(key, None)
                self.texts.pop(key, None)

    def _asked(self, question: Question) -> str | None:
        """What a person answers; None where nobody is there."""
        if self._person.ask is None:
            return None
        offer = self._offer(question)
        ways = "".join(f", or {way.name}" for way in question.ways)
        shown = f" (Enter: {offer})" if offer else ""
        unit = f" [{question.unit}]" if question.unit else ""
        while True:
            text = self._person.ask(f"{question.key}{unit}{ways}: {question.what}{shown}? ").strip()
            if text == HELP:
                self._person.tell(f"{question.how} docs/new_robot.md has pictures.")
            elif text == BACK or text in QUESTIONS:
                self._reopen(text)
            elif not text and not offer:
                self._person.tell(f"Expected is {question.what}; {HELP} says how to find it, Ctrl-C keeps the answers.")
            else:
                return text or offer.partition(",")[0]

    def _reopen(self, word: str) -> None:
        """Ask an earlier question anew, by its name or as the one before; where there is none, that is said.

        Raises:
            _OpenedError: there is.
        """
        for_it = self._open[-2:-1]
        before = [*for_it, *([] if for_it else list(self.found)[-1:])]
        keys = before if word == BACK else [word] if word in self.texts else []
        if keys:
            raise _OpenedError(keys[0])
        none = "There is no question before this one." if word == BACK else f"{word} has no answer yet."
        self._person.tell(none)

    def _offer(self, question: Question) -> str:
        """What Enter answers: a way whose needs are all answered, with its result, or what the question offers."""
        for way in reversed(question.ways):
            if not needed(way, self._known):
                try:
                    return f"{way.name}, {answered(question, way.name, self._known).value:.4g} {question.unit}"
                except ConfigError:
                    continue
        return f"{question.offered}, {ValueProvenance.GUESS}" if question.offered else ""
