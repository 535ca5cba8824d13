"""Recordings of moving bodies: data type, readers, frame status, resampling, analysis."""
