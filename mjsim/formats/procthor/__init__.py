"""House JSON of ProcTHOR, read and written."""
