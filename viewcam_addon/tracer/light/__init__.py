"""Light: random numbers, what gives light, how surfaces scatter it, and the integrator that puts them together."""
