"""How large a benchmark is: the sizes of every job, and how long each timing may take."""

from __future__ import annotations

from dataclasses import dataclass, replace

__all__ = ["PLANS", "Plan"]


@dataclass(frozen=True)
class Plan:
    """The sizes of one run.

    Parameters
    ----------
    bandlimits, directions : tuple of int
        L and N of the transforms that are held against ducc0.
    threads : tuple of int
        Numbers of threads.
    nsides : tuple of int
        HEALPix resolutions; the bandlimit is 2 nside + 1.
    s2let_bandlimits : tuple of int
        L of the transforms that are held against pys2let, N = 3.
    batch_bandlimits : tuple of int
        L of the batches.
    batch_nsides : tuple of int
        HEALPix resolutions of the batches.
    batch : int
        Maps in a batch.
    growth_directions : tuple of int
        N over which growth is fitted.
    growth_bandlimit : int
        L at which growth in N is fitted.
    memory : tuple of (int, int)
        L and N whose memory is measured.
    fewest : int
        Rounds of a timing, at least.
    budget : float
        Seconds for which a timing goes on after those.
    """

    bandlimits: tuple[int, ...]
    directions: tuple[int, ...]
    threads: tuple[int, ...]
    nsides: tuple[int, ...]
    s2let_bandlimits: tuple[int, ...]
    batch_bandlimits: tuple[int, ...]
    batch_nsides: tuple[int, ...]
    batch: int
    growth_directions: tuple[int, ...]
    growth_bandlimit: int
    memory: tuple[tuple[int, int], ...]
    fewest: int
    budget: float

    def with_threads(self, threads: tuple[int, ...]) -> Plan:
        """Return the plan with other numbers of threads."""
        return replace(self, threads=threads)


PLANS = {
    "full": Plan(
        bandlimits=(128, 256, 512, 1024, 2048),
        directions=(1, 3, 5),
        threads=(1, 2),
        nsides=(256, 512),
        s2let_bandlimits=(16, 32, 64, 128, 256, 512),
        batch_bandlimits=(128, 256, 512),
        batch_nsides=(64, 128, 256),
        batch=16,
        growth_directions=(1, 2, 3, 4, 5, 6, 7, 8),
        growth_bandlimit=512,
        memory=((512, 3), (1024, 3), (2048, 3), (2048, 5)),
        fewest=4,
        budget=4.0,
    ),
    "standard": Plan(
        bandlimits=(128, 256, 512, 1024, 2048),
        directions=(1, 3, 5),
        threads=(1, 2),
        nsides=(256, 512),
        s2let_bandlimits=(16, 32, 64, 128, 256),
        batch_bandlimits=(128, 256),
        batch_nsides=(64, 128),
        batch=16,
        growth_directions=(1, 2, 3, 4, 5),
        growth_bandlimit=256,
        memory=((512, 3), (1024, 3)),
        fewest=3,
        budget=1.0,
    ),
    "quick": Plan(
        bandlimits=(64, 128),
        directions=(1, 3),
        threads=(1, 2),
        nsides=(32, 64),
        s2let_bandlimits=(32, 64),
        batch_bandlimits=(64,),
        batch_nsides=(32,),
        batch=16,
        growth_directions=(1, 2, 3, 4),
        growth_bandlimit=64,
        memory=((128, 3),),
        fewest=4,
        budget=0.5,
    ),
    "smoke": Plan(
        bandlimits=(8, 16),
        directions=(1, 2),
        threads=(1, 2),
        nsides=(4,),
        s2let_bandlimits=(16,),
        batch_bandlimits=(8,),
        batch_nsides=(4,),
        batch=3,
        growth_directions=(1, 2, 3),
        growth_bandlimit=8,
        memory=((16, 2),),
        fewest=1,
        budget=0.0,
    ),
}
