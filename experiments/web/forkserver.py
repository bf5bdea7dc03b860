"""The process from which workers are forked: house and kernels are loaded once, and shared by all of them.

It uses one thread and no OpenGL, neither of which survives a fork; pictures are drawn in a process of their own.
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

from experiments.house import House
from experiments.trials import warmup
from experiments.web.encoders import Image
from experiments.web.worker import Worker
from mjsim.model.catalogue import Catalogue
from mjsim.render import render_pictures


class ForkServer:
    """Forks a worker for each socket that it is sent, until the server is gone.

    Args:
        control: Socket to the server.
        house: Name of the house that is played in.
    """

    def __init__(self, control: socket.socket, house: str) -> None:
        self._control, self._name = control, house
        self._pictures: dict[str, Image] = {}

    def run(self) -> None:
        """Serve until the server is gone."""
        house = House.load(self._name)
        self._drawing = drawing = _draw_pictures(house.catalogue)
        warmup.plan()
        warmup.act(house)
        gc.freeze()  # collecting garbage would copy what is shared
        sources: list[socket.socket | Pipe] = [self._control, drawing]
        while True:
            for ready in wait(sources):
                if ready is drawing:
                    sources.remove(drawing)
                    self._take_pictures(drawing)
                elif not self._fork(house):
                    return

    def _take_pictures(self, drawing: Pipe) -> None:
        with suppress(EOFError), drawing:  # where they could not be drawn, workers try again and say why
            self._pictures = drawing.recv()

    def _fork(self, house: House) -> bool:
        """Fork a worker; False if the server is gone."""
        _, descriptors, _, _ = socket.recv_fds(self._control, 1, 1)
        if not descriptors:
            return False
        with socket.socket(fileno=descriptors[0]) as link:
            if os.fork() == 0:
                self._control.close()
                self._drawing.close()
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                _exit_after(Worker(link, self._name, house, self._pictures))
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
    arguments = parser.parse_args()
    os.environ.setdefault("LP_NUM_THREADS", "1")  # of software rendering; many workers share the machine
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody asks how a worker ended
    with socket.socket(fileno=arguments.descriptor) as control:
        ForkServer(control, arguments.house).run()


if __name__ == "__main__":
    main()
