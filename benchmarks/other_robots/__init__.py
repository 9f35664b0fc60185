"""Does `twbal diagnose` find what is missing in recordings of robots that share no code with twbal's simulations?"""
