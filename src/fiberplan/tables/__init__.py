"""Bytes and text: files that appear whole, tables as people have them, FITS, Yanny and ESO parameter files.

Nothing here knows a class of fiberplan's; what is read is handed up as columns with units, rows with their lines.
"""
