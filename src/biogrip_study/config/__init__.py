"""The study's config, checked and turned into typed objects."""
