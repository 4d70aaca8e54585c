"""Calibration: measurements behind the thresholds of forecasts and the stored limits of the engines."""
