"""Load everything that workers share. The fork server imports this module."""

import os

from experiments.web.protocol import HOUSE
from experiments.web.worker import main as main
from experiments.web.worker.houses import preload

preload(os.environ[HOUSE])
