"""Times the misfit of a population, and an identification, against peers; prints Markdown.

Every row is measured in this one run, so the ratios hold wherever it runs; the
seconds do not.
"""

from benchmarks.identification import identification_rows
from benchmarks.misfit import misfit_rows
from benchmarks.setup import markdown

if __name__ == "__main__":
    print("### Misfit of 500 individuals against 4001 samples\n")
    print(markdown(misfit_rows()))
    print("\n### One identification at the paper's budget\n")
    print(markdown(identification_rows()))
