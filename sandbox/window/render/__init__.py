"""Drawing: a snapshot of one frame onto a pygame surface."""
