"""The requirements, in the order in which they are checked; importing a module enters them."""

# isort: off
from . import heartbeat, status, information, command, switch, configuration, interval
from . import thermal, totals
# isort: on

__all__ = ['command', 'configuration', 'heartbeat', 'information', 'interval', 'status',
           'switch', 'thermal', 'totals']
