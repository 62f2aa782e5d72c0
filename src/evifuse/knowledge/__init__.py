"""Prototypes as YAML that a person can read and change, and what loads them."""

from evifuse.knowledge.load import BUILT_IN, built_in_text, load_knowledge, parse_knowledge
from evifuse.knowledge.save import knowledge_text, save_knowledge

__all__ = [
    "BUILT_IN",
    "built_in_text",
    "knowledge_text",
    "load_knowledge",
    "parse_knowledge",
    "save_knowledge",
]
