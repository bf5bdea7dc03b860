"""Module imported by the fork server to load everything that workers share."""

import os

from experiments.web.protocol import HOUSE
from experiments.web.worker import main as main
from experiments.web.worker.houses import preload

preload(os.environ[HOUSE])
