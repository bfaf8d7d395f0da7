"""Options of `biogrip identify` that set a key of the config; columns of tables may be the same."""

KEYS = {
    "time": "measurement.time",
    "frequency": "measurement.frequency",
    "sd": "measurement.sd",
    "load": "measurement.load",
    "from": "measurement.from_s",
    "until": "measurement.until_s",
    "noise": "measurement.noise_rad",
    "noise_model": "measurement.noise_model",
    "noise_share": "measurement.noise_share",
    "offset": "measurement.offset",
    "drift": "measurement.drift",
    "model": "sample.model",
}
"""Keys by the options' names, with underscores for hyphens."""
