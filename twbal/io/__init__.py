"""Files in and out: episode logs, checkpoints, and logs that twbal did not make."""
