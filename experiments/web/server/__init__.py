"""The server process of `mjsim play`: pages, visits, the queue and the sockets of browsers.

It serves the browsers of participants and players; it simulates nothing and trusts no browser.
"""
