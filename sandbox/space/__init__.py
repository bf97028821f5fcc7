"""Any `pymunk.Space` on trial: a linter, a recording of its steps, the ledger of its energy, figures of its run."""
