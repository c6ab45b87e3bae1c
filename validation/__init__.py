"""Problems with known answers, and what the program makes of them."""
