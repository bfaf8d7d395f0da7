"""Source files that a job is made of: see `biogrip.products.source_files`."""

from biogrip.products.source_files import fingerprint as fingerprint
from biogrip.products.source_files import source_files as source_files
