"""The record of a run: one ``*.vtkhdf`` file that ParaView opens, h5py reads and no kill can break."""

from contact.record.compare import Difference, compare
from contact.record.layout import CERTIFICATE, PHASES, Grid, StepData
from contact.record.reader import RecordReader
from contact.record.show import show
from contact.record.writer import Record

__all__ = ["CERTIFICATE", "PHASES", "Difference", "Grid", "Record", "RecordReader", "StepData", "compare", "show"]
