"""The laws of `restitution`, compiled, for kernels. For one contact at a time, compiling takes longer than it saves."""

from sandbox.engines.common import restitution
from sandbox.engines.common.kernel import bare_kernel

compiled_rebound = bare_kernel(restitution.rebound)
compiled_kicked = bare_kernel(restitution.kicked)
compiled_kick_gain = bare_kernel(restitution.kick_gain)
