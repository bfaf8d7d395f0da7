"""The paper's numerical study; its rules are in workflow/."""


include: "workflow/Snakefile"


# The default target of an included file does not count.
rule study:
    default_target: True
    input:
        rules.all.input,
