"""GPs by GPyTorch: any kernel of its, and fits of 10⁵ samples. Imported only where one of these is asked for."""
