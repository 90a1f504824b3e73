"""Files that are written whole or not at all."""

import os
from contextlib import contextmanager


@contextmanager
def whole_file(path):
    """A name beside path to write to, which takes its place once all is written: no half file is left. What is no file
    (/dev/stdout, a pipe) is written to as it is, and links stay."""
    path = os.path.realpath(path)
    if os.path.exists(path) and not os.path.isfile(path):
        yield path
        return
    part = f"{path}.{os.getpid()}.part{os.path.splitext(path)[1]}"
    try:
        yield part
        os.replace(part, path)
    finally:
        if os.path.exists(part):
            os.remove(part)
