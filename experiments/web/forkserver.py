"""The process from which workers are forked: house and kernels are loaded once, and shared by all of them.

It uses one thread and no OpenGL, neither of which survives a fork; pictures are drawn in a process of their own. A
server that dies leaves it behind: it waits in the folder of the visits for the next one (`rejoining.py`).
"""

import argparse
import gc
import os
import signal
import socket
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection as Pipe
from multiprocessing.connection import wait
from pathlib import Path

from experiments.house import House
from experiments.trials import warmup
from experiments.web.encoders import Image
from experiments.web.messages import END, FORK
from experiments.web.rejoining import let_go_of_stderr, wait_for_server
from experiments.web.worker import Worker
from mjsim.model.catalogue import Catalogue
from mjsim.render import render_pictures


class ForkServer:
    """Forks a worker for each socket that it is sent, until it is told to end, or no server is there any more.

    Args:
        control: Socket to the server.
        house: Name of the house that is played in.
        rejoin: Where to wait for the next server: a folder, and the name of a socket in it.
    """

    def __init__(self, control: socket.socket, house: str, rejoin: Path) -> None:
        self._control, self._name, self._rejoin = control, house, rejoin
        self._pictures: dict[str, Image] = {}
        self._drawing: Pipe | None = None

    def run(self) -> None:
        """Serve until told to end."""
        house = House.load(self._name)
        self._drawing = _draw_pictures(house.catalogue)
        warmup.plan()
        warmup.act(house)
        gc.freeze()  # collecting garbage would copy what is shared
        while True:
            ready = wait([self._control] if self._drawing is None else [self._control, self._drawing])
            if self._drawing in ready:
                self._take_pictures()
            elif not self._serve(house):
                return

    def _take_pictures(self) -> None:
        if (drawing := self._drawing) is not None:
            self._drawing = None
            with suppress(EOFError), drawing:  # where they could not be drawn, workers try again and say why
                self._pictures = drawing.recv()

    def _serve(self, house: House) -> bool:
        """Do what the server says; False if this is to end, or no server came in the place of one that is gone."""
        try:
            word, descriptors, _, _ = socket.recv_fds(self._control, 1, 1)
        except OSError:
            word, descriptors = b"", []
        if word == FORK and descriptors:
            self._fork(house, descriptors[0])
        elif word == END:
            return False
        elif not word:
            return self._rejoined()
        return True

    def _fork(self, house: House, descriptor: int) -> None:
        with socket.socket(fileno=descriptor) as link:
            if os.fork() == 0:
                self._control.close()
                if self._drawing is not None:
                    self._drawing.close()
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                _exit_after(Worker(link, self._name, house, self._pictures))

    def _rejoined(self) -> bool:
        self._control.close()
        let_go_of_stderr()
        link = wait_for_server(self._rejoin.parent, name=self._rejoin.name)
        if link is None:
            return False
        self._control = link
        return True


def _exit_after(worker: Worker) -> None:
    """Run a worker in this process, which then ends without a word: the process it comes from goes on."""
    code = 1
    try:
        worker.run()
        code = 0
    finally:
        os._exit(code)


def _draw_pictures(catalogue: Catalogue) -> Pipe:
    """Draw pictures in a process of their own, which says them to the end of a pipe that is given back."""
    context = get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    context.Process(target=_say_pictures, args=(theirs, ours, catalogue), daemon=True).start()
    theirs.close()
    return ours


def _say_pictures(pipe: Pipe, other_end: Pipe, catalogue: Catalogue) -> None:
    other_end.close()  # so that nobody is left to read once the process that asked is gone
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    with suppress(BrokenPipeError):
        pipe.send(render_pictures(catalogue))


def main() -> None:
    """Serve on the socket whose file descriptor is given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("descriptor", type=int)
    parser.add_argument("house")
    parser.add_argument("rejoin", type=Path)
    arguments = parser.parse_args()
    os.environ.setdefault("LP_NUM_THREADS", "1")  # of software rendering; many workers share the machine
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody asks how a worker ended
    ForkServer(socket.socket(fileno=arguments.descriptor), arguments.house, arguments.rejoin).run()


if __name__ == "__main__":
    main()
