"""Many fields: each allocated, planned from where the field before ended, proven, written and kept count of.

1. `fields`: what is observed, in which order, and which fields are a chain, where each begins as the one before ends
2. `survey_targets`: what is to be observed, and which of it lies in a field; `fingerprint`: what inputs are the same
3. `precedence`: which fields a field has to wait for, so that any number at a time give the same plans
4. `work`: one field, by whoever does it: allocated, planned, certified, as bytes; `record`: what is kept of it
5. `workers`: who does it: this process, others on this machine, a cluster
6. `ledger`: a line for each field that is done, on disk before the next is believed
7. `run`: these in order; `survey`: what comes of it, and its tables; `summary_tables`, `report`: as files
8. `order`: an order of fields that shortens the motion
"""
