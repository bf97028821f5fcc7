"""A `pymunk.Space` of any contents on trial: what is wrong with it, and what to change."""
