"""What a run leaves behind: its directory, its log, its recording, and the metrics that follow from them."""
