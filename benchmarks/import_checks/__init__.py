"""Import checks on logs of robots in MuJoCo: no false warning, and what of planted faults is found."""
