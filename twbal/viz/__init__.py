"""The pictures that the tool draws, one file per kind; the only folder that knows matplotlib."""
