"""Estimation: priors, maximum a posteriori, marginal likelihood, identifiability, outliers."""
