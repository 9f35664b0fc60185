"""How fast commands answer a robot in real time, beside other programs and alone, and how fast a key is obeyed."""
