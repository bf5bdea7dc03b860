"""Imported once by the fork server: everything that workers share is loaded here, before they are forked."""

import os

from experiments.web.protocol import HOUSE
from experiments.web.worker import main as main
from experiments.web.worker.houses import preload

preload(os.environ[HOUSE])
