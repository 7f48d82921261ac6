"""The equations of the fluid: kernel, pair terms, and the compiled sums over pairs that are made of them."""
