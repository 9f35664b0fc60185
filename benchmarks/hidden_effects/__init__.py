"""Does `twbal diagnose` find effects that were hidden in another engine, in other forms than it knows?"""
