"""HTML reports on studies, with figures and checks of statistical assumptions."""
