"""One XML parser for every robot file: bounded, without entities from elsewhere, forgiving in what does no harm."""

from __future__ import annotations

from typing import Any

from hecbench.errors import InputError

_HARMLESS = "NS_ERR_UNDEFINED_NAMESPACE"
"""A prefix nobody declared: the names with a prefix are other programs', and are dropped."""

_DECLARED = ("ENCODING", "VERSION")
"""What may be wrong with the declaration in the first line; the document is then read without it."""


def parse(content: bytes, where: str, *, mesh: bool = False) -> Any:
    """The root element (lxml) of a document in any encoding, without comments.

    Text that is not in its encoding is taken for Latin-1, in which every byte is a letter: it stands in comments
    as a rule. A declaration of another version than XML's only one is passed over.

    Args:
        content: the file.
        where: for the error: the file's name and what it should be.
        mesh: texts of more than 10 MB are allowed, as lists of vertices need them, and 2048 levels.

    Raises:
        InputError: it is no XML, nested deeper than 256 elements, or it declares entities.
    """
    from lxml import etree

    content = content.lstrip()
    root, fault = _root(content, _parser(mesh))
    if root is None or (fault is not None and any(word in fault.type_name for word in _DECLARED)):
        head, end, body = content.partition(b"?>")
        plain = body if head.startswith(b"<?xml") and end else content
        again, other = _root(plain.decode("latin-1").encode(), _parser(mesh))
        root, fault = (again, other) if again is not None else (root, fault)
    if root is None or fault is not None:
        reason = "it is empty" if fault is None else f"line {fault.line}: {fault.message}"
        raise InputError(f"{where}: {reason}")
    declared = root.getroottree().docinfo.internalDTD
    if declared is not None and any(True for _ in declared.iterentities()):
        raise InputError(f"{where}: it declares XML entities; write their text out")
    etree.cleanup_namespaces(root)
    return root


def _parser(huge: bool) -> Any:
    from lxml import etree

    return etree.XMLParser(
        recover=True,
        huge_tree=huge,
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        remove_comments=True,
        remove_pis=True,
    )


def _root(content: bytes, parser: Any) -> tuple[Any, Any]:
    """The root and the first fault that does harm; either may be None."""
    from lxml import etree

    try:
        root = etree.fromstring(content, parser)
    except etree.XMLSyntaxError:
        root = None
    return root, next((fault for fault in parser.error_log if fault.type_name != _HARMLESS), None)


def local_name(element: Any) -> str:
    """The tag without its namespace."""
    return str(element.tag).rpartition("}")[2]


def drop_prefixed(root: Any) -> None:
    """Remove the elements and attributes whose names have a prefix or namespace: other programs' extensions.

    The namespace of the root itself, as a default for the whole document, is taken off the names.
    """
    space = root.tag.rpartition("}")[0] + "}" if "}" in root.tag else None
    for element in list(root.iter()):
        if space is not None and isinstance(element.tag, str) and element.tag.startswith(space):
            element.tag = local_name(element)
        if element is not root and (
            not isinstance(element.tag, str) or ":" in element.tag or "}" in element.tag
        ):
            if element.getparent() is not None:
                element.getparent().remove(element)
            continue
        for name in [name for name in element.attrib if ":" in name or "}" in name]:
            del element.attrib[name]
