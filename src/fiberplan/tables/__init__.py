"""Bytes and text. No class of fiberplan is known here: columns with units and rows with their lines are handed up.

- `atomic`: files that appear whole or not at all
- `contents`: the bytes of a file, read once and whole
- `formats`: kinds of files, how each is told from others, and what reads it
- `input_table`: a table that people bring, with errors that name file, row, column and value; `table_reader`: from
  whatever astropy reads
- `ecsv`: ECSV tables by their text alone
- `fits_tables`: FITS tables in and out
- `yanny`: the ``.par`` files of SDSS
- `paf`: the parameter files of ESO
- `uncollected`: many numbers, without looking for garbage in between
- `wording`: what messages say of names that are nearly right, and of errors from elsewhere
"""
