"""How long the fit of three GPs takes, and whether its evidence is the best there is, beside BoTorch."""
