"""An import-linter contract type that import-linter lacks: a list of what a package may import."""

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output


class OnlyImports(Contract):
    """A package imports nothing but itself and the modules allowed, directly.

    Configuration options:
        package: The package that is held to the list, sub-modules included.
        allowed: Top-level modules outside the package that it may import; `__future__` always may.
    """

    type_name = "only_imports"

    package = fields.StringField()
    allowed = fields.SetField(subfield=fields.StringField())

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """List the imports that leave the package for a module that is not allowed."""
        package = str(self.package)
        if package not in graph.modules:
            raise ValueError(f"OnlyImports.package must be a module of the project, got {package!r}.")
        inside = {package} | graph.find_descendants(package)
        allowed = {"__future__", *self.allowed}  # type: ignore[misc]  # import-linter fills the field in
        broken = sorted(
            (importer, imported)
            for importer in inside
            for imported in graph.find_modules_directly_imported_by(importer)
            if imported not in inside and imported not in allowed
        )
        return ContractCheck(kept=not broken, metadata={"broken": broken})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print one line per import that breaks the contract."""
        for importer, imported in check.metadata["broken"]:
            output.print_error(f"- {importer} imports {imported}, which is not on the list", bold=False)
        output.new_line()
