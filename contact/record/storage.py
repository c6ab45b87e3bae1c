"""A file for HDF5 to write on that stays readable whenever the process is killed.

HDF5 gives no such promise by itself: a flush rewrites an index's root before the nodes that it now points to, and
states the file's new length before the file has it. Between two such writes a kill loses a data set, or the file.
The order of the writes is the remedy, and it can be chosen, because h5py accepts any file-like object.
"""

from __future__ import annotations

import os
from pathlib import Path

import h5py

PAGE = 4096


class OrderedFile:
    """A new file that HDF5 writes through :meth:`hdf5`, each flush in an order that no kill can hurt.

    Bytes beyond the end of the last flush are referred to by nothing yet: they are written at once. Bytes inside it are
    held until the flush, which makes the file as long as HDF5 wants it, then writes the superblock, then index nodes
    from the root downwards, so that every reference leads to what is already there, and in the end the file's first
    page as a whole: what HDF5 placed there changes at one stroke. This relies on space never being freed: the writer
    only ever extends data sets.

    Parameters
    ----------
    path : Path
        The file, created or emptied.

    Raises
    ------
    ValueError
        If the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o666)
        except OSError as error:
            raise ValueError(f"{path}: cannot be written ({error.strerror})") from None
        self._position = 0
        self._length = 0  # as HDF5 wants it; the file has it from the next flush on
        self._flushed = 0
        self._held: dict[int, bytes] = {}

    def hdf5(self) -> h5py.File:
        """The HDF5 file that is kept in this one.

        It has no chunk cache: rows are written without the rest of their chunk. Nodes of its indices (2 to 4 KiB) lie
        within a page, because a kill can cut a write where a page ends.
        """
        return h5py.File(
            self, "w", libver="earliest", rdcc_nbytes=0, alignment_threshold=PAGE // 2, alignment_interval=PAGE
        )

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Move to `offset` from the beginning or (`whence` ``SEEK_END``) from the end of the file."""
        self._position = offset + (self._length if whence == os.SEEK_END else 0)
        return self._position

    def tell(self) -> int:
        """Position of the next read or write [bytes]."""
        return self._position

    def read(self, size: int) -> bytes:
        """`size` bytes at the position, those held included."""
        data = bytearray(size)
        self.readinto(memoryview(data))
        return bytes(data)

    def readinto(self, buffer: memoryview) -> int:
        """Fill `buffer` from the position, with zeros where nothing was written."""
        start, size = self._position, len(buffer)
        found = os.preadv(self._descriptor, [buffer], start)
        buffer[found:] = bytes(size - found)
        for address, held in self._held.items():
            low, high = max(start, address), min(start + size, address + len(held))
            if low < high:
                buffer[low - start : high - start] = held[low - address : high - address]
        return size

    def write(self, data: memoryview) -> int:
        """Write `data` at the position, or hold it until the flush where the file already had these bytes."""
        if self._position >= self._flushed:
            self._write_at(self._position, data)
            self._length = max(self._length, self._position + len(data))
        else:
            earlier = self._held.pop(self._position, b"")  # what arrives last must be the last in line
            self._held[self._position] = bytes(data) + earlier[len(data) :]
        return len(data)

    def truncate(self, size: int) -> int:
        """Take note of the file's length [bytes]; the file never gets shorter."""
        self._length = max(self._length, size)
        return size

    def flush(self) -> None:
        """Write what is held: the length, the superblock, index nodes by falling level, all else, the first page."""
        os.ftruncate(self._descriptor, self._length)
        page = bytearray(os.pread(self._descriptor, PAGE, 0))
        for address, data in sorted(self._held.items(), key=_rank):
            if address + len(data) <= len(page):
                page[address : address + len(data)] = data
            if address == 0 or address + len(data) > len(page):
                self._write_at(address, data)
        self._write_at(0, bytes(page))
        self._held.clear()
        self._flushed = self._length

    def close(self) -> None:
        """Flush and close the file."""
        self.flush()
        os.close(self._descriptor)

    def _write_at(self, address: int, data: bytes | memoryview) -> None:
        while (written := os.pwrite(self._descriptor, data, address)) < len(data):
            data, address = memoryview(data)[written:], address + written


def _rank(held: tuple[int, bytes]) -> tuple[bool, int]:
    """Turn of a held write: the superblock at address 0, then B-tree nodes from the root down, then all else.

    The level of a version 1 B-tree's node is its sixth byte (HDF5 File Format Specification, III.A.1).
    """
    address, data = held
    return address != 0, -data[5] if data.startswith(b"TREE") else 0
