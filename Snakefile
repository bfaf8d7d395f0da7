"""The paper's numerical study; its rules are in workflow/."""


include: "workflow/Snakefile"
