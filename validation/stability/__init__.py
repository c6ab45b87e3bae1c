"""The stability campaign: the stiff and extreme set as sweeps, one file a family, and random trials.

`campaign` imports the families, which enter their sweeps into `point.SWEEPS`.
"""
