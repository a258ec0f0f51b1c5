"""Parts of tools/gpu-report."""
