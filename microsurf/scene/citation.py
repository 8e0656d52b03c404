"""One work of the literature, as a list of references and a .bib file print it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Citation:
    """One entry of a list of references.

    ``kind`` is its BibTeX type; ``venue`` the journal, the proceedings or the publisher,
    ``where`` volume, number and pages as they are printed. ``what_for`` says what
    microsurf takes from it.
    """

    key: str
    kind: str
    authors: tuple[str, ...]
    title: str
    venue: str
    where: str
    year: int
    what_for: str
    doi: str = ""

    @property
    def text(self) -> str:
        """As printed, without the DOI."""
        parts = [", ".join(self.authors), self.title, self.venue, self.where, str(self.year)]
        return ". ".join(part for part in parts[:2]) + ". " + ", ".join(p for p in parts[2:] if p)

    @property
    def bibtex(self) -> str:
        """As an entry of a .bib file, in UTF-8."""
        venue = {"article": "journal", "inproceedings": "booktitle"}.get(self.kind, "howpublished")
        fields = {
            "author": " and ".join(self.authors),
            "title": f"{{{self.title}}}",
            venue: self.venue,
            "year": str(self.year),
            "note": self.where,
            "doi": self.doi,
        }
        lines = [f"  {name} = {{{value}}}," for name, value in fields.items() if value]
        return "\n".join([f"@{self.kind}{{{self.key},", *lines, "}"])
