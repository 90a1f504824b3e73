"""Which recognised shapes take part: not those that lie on others, nor those too thin to be told from none."""

from dataclasses import dataclass, replace

import numpy as np

from ...pdm_core.scene import LOST
from ...pdm_core.shapes.shape import tolerance_of
from .read_surfaces import twins

THIN = 1.01 * LOST  # tolerances


@dataclass(eq=False)
class Accepted:
    """taken: [(MeshObject, [Piece])]; pieces: [Piece] each once; place: [(n,)] of each object's pieces among them, or
    of what stands for them; refused: [(name, reason)]; warnings: [sentence]."""

    taken: list
    pieces: list
    place: list
    refused: list
    warnings: list


def accept_pieces(taken, rounding):
    """Accepted of [(MeshObject, [Piece])]: of two shapes on one another, each of which would hide the other, the later
    is the earlier; what is too thin, or nearly transparent, is the object's next one. An object of nothing else is
    refused."""
    pieces = [piece for _, own in taken for piece in own]
    if not pieces:
        return Accepted([], [], [], [], [])
    owner = np.repeat(np.arange(len(taken)), [len(own) for _, own in taken])
    thin = np.array([p.shape.thickness for p in pieces]) < THIN * tolerance_of([p.shape for p in pieces], rounding)
    clear = np.array([bool(piece.look.absent) for piece in pieces]) & ~thin
    opened = {piece.body for piece, is_clear in zip(pieces, clear) if is_clear} - {()}
    pieces = [replace(piece, body=()) if piece.body in opened else piece for piece in pieces]  # light comes in
    twin = np.full(len(pieces), -1)
    thick = np.flatnonzero(~(thin | clear))
    found = twins([pieces[k] for k in thick])
    twin[thick[found >= 0]] = thick[found[found >= 0]]
    stays = (twin < 0) & ~thin & ~clear
    lives = np.bincount(owner, stays, len(taken)) > 0
    place = np.cumsum(stays) - 1
    first = np.full(len(taken), -1)
    first[owner[stays][::-1]] = place[stays][::-1]
    place = np.where(thin | clear, first[owner], np.where(twin >= 0, place[np.maximum(twin, 0)], place))
    out = Accepted([], [pieces[k] for k in np.flatnonzero(stays)], [], [], [])
    for k, (mesh, own) in enumerate(taken):
        mine = np.arange(*np.searchsorted(owner, [k, k + 1]))
        doubles = {taken[owner[twin[j]]][0].name: None for j in mine if twin[j] >= 0}
        if lives[k]:
            out.taken.append((mesh, own))
            out.place.append(place[mine])
            out.warnings += _said(mesh.name, doubles, twin[mine] >= 0, thin[mine], clear[mine])
        elif doubles:
            name = next(iter(doubles))
            out.refused.append((mesh.name, f"lies exactly on object {name!r}; move or delete one of them"))
        else:
            out.refused.append((mesh.name, "is too small for its distance from the scene's origin; move it nearer"))
    return out


def _said(name, doubles, *parts):
    """Warnings of an object of which parts (n,) bool are doubled, too thin, nearly transparent."""
    texts, (doubled, thin, clear) = [], (int(part.sum()) for part in parts)
    if clear:
        texts.append(f"Object {name!r}: {clear:,} of its faces are clear: they block nothing and show others' light")
    if doubled:
        others = ", ".join(repr(other) for other in list(doubles)[:3])
        texts.append(f"Object {name!r}: {doubled:,} of its faces lie on others ({others}): they show their light")
    if thin:
        texts.append(f"Object {name!r}: {thin:,} faces are too thin so far from the origin: they are left out")
    return texts
