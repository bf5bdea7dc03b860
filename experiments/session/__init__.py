"""One session: the loop, the assistant, what the participant perceives, how it walks, and who watches."""
