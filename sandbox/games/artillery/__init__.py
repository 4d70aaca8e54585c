"""Artillery: tanks on ground that shells dig up.

`ground.py` takes circles out of columns, `flight.py` says where shells go, `aim.py` and `bot.py` find the shot that
hits, `miss.py` says by how much an integrator misses, `tanks.py` keeps who has what, and `rules.py` plays it all.
"""
