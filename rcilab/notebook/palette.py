"""The colours of the joints, the same in every picture of a notebook."""

from __future__ import annotations

# Okabe and Ito's palette, distinct with every kind of colour vision, without its yellow (too pale on white).
JOINT_COLORS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7", "#000000")
