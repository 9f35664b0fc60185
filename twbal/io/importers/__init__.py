"""Logs that twbal did not make: files of columns, read by a mapping into episodes. See docs/import.md."""
