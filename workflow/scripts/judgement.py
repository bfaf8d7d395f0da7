"""Judge the first trace of a case, and its response without noise if it is simulated."""

from biogrip.stages.identification import expect, judge
from biogrip.stages.job import logged, run

with logged(snakemake):
    run(snakemake, judge)
    if snakemake.input.target:
        run(snakemake, expect)
