"""System identification: recordings, the predictor, its noise, and fits by prediction error."""
