"""Joints of the reference engine: springs as forces, the rest by impulses or by moving bodies into place."""
