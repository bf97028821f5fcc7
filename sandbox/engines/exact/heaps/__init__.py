"""Discs that touch, beyond single contacts: found by `touching`, for impacts without end and for heaps at rest.

`collapse` ends sequences of impacts, `islands` freezes and wakes heaps, and `statics` finds what contacts carry: for
heaps their weight, and for impacts without end the impulses that stop them.
"""
