"""A person at the keyboard: the server, its worker processes and the client that runs in the browser.

It serves people who run `mjsim play`, alone or for the participants of a study.
"""
