"""Imperfections: what makes a crane in the field differ from the crane on paper."""
