"""What is linked, at whatever remove, is one part: groups of scenes that share vehicles, recordings of one place."""

import numpy as np
from jaxtyping import Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


def linked(first: Int[np.ndarray, " L"], second: Int[np.ndarray, " L"], count: int) -> Int[np.ndarray, " nodes"]:
    """Number of the part of each of ``count`` nodes, of which L pairs are linked."""
    links = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    return connected_components(links, directed=False)[1].astype(np.int64)


def parts_of_groups(vehicle: Int[np.ndarray, " N"], group: Int[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
    """Number of the part of each sample's group, where groups that share a vehicle are one part."""
    names, groups = np.unique(group, return_inverse=True)
    keys, vehicles = np.unique(vehicle, return_inverse=True)
    return linked(groups, len(names) + vehicles, len(names) + len(keys))[groups]
