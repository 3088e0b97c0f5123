"""Bytes and text. No class of fiberplan is known here: columns with units and rows with their lines are handed up.

- `atomic`: files that appear whole or not at all
- `contents`: the bytes of a file, read once and whole
- `formats`: kinds of files, how each is told from others, and what reads it
- `table_reader`: tables that people bring, with errors that name file, row, column and value
- `ecsv`: ECSV tables by their text alone
- `fits_tables`: FITS tables in and out
- `yanny`: the ``.par`` files of SDSS
- `paf`: the parameter files of ESO
"""
