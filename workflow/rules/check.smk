"""The results beside those that are published: compared, or put in their place."""

# A config of the same name has its published results in a folder of its own. What has no name, on
# the command line or of a module, has nothing published; batches and files for print change no result.
UNNAMED = "unnamed" if config.keys() - {"batch_size", "pdf"} else ""
OVERLAYS = [UNNAMED, *(file.stem for file in CONFIGS)]
OVERLAY = OVERLAYS[-1]
PUBLISHED = shipped("results/published") / OVERLAY


def published(kind, *suffixes):
    """Files of a kind that are published; of the default study, or that are to be.

    A table is published as CSV and, made of its HTML, as Markdown.
    """
    names = {file.name.replace(".md", ".html") for file in (PUBLISHED / kind).glob("*")}
    there = {f"results/{kind}/{name}" for name in names}
    ours = {file for suffix in suffixes for file in made(kind, suffix)}
    return sorted(there if OVERLAY else there | ours)


# Neither has an output, so that neither is ever taken for done.
rule check:
    input:
        made=published("tables", ".csv", ".html"),
    log:
        "results/logs/check.log",
    localrule: True
    params:
        published=PUBLISHED / "tables",
    message:
        "Comparing the tables with the published ones"
    script:
        "../paper/check.py"


rule publish:
    input:
        tables=published("tables", ".csv", ".html"),
        figures=published("figures", ".png", *[".pdf"] * STUDY.config.pdf),
        page=[] if OVERLAY else "results/report.html",
    log:
        "results/logs/publish.log",
    localrule: True
    params:
        published=PUBLISHED,
    message:
        "Publishing the tables, the figures and the page"
    script:
        "../paper/publish.py"
