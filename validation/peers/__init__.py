"""Other ways to the same answer: engines that microsurf is compared with, never built on."""
