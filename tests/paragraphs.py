#!/usr/bin/env python3
"""Prints each paragraph of a page that has more than 120 words; exit code 1 if there is one.

    tests/paragraphs.py README.md docs/*.md

An item of a list is a paragraph; tables, headings and code are none.
"""
import re
import sys

MOST_WORDS = 120


def paragraphs(text):
    """@return (line on which it begins, its words) of each."""
    is_code, first, words = False, 0, []
    for number, line in enumerate(text.split("\n") + [""], 1):
        stripped = line.strip()
        is_fence = stripped.startswith("```")
        is_code ^= is_fence
        is_item = re.match(r"(-|\*|\d+\.) ", stripped) is not None
        if is_code or is_fence or is_item or not stripped or stripped[0] in "|#":
            if words:
                yield first, words
            words = []
        if not (is_code or is_fence or not stripped or stripped[0] in "|#"):
            first = first if words else number
            words += stripped.split()


def main():
    found = 0
    for path in sys.argv[1:]:
        with open(path, encoding="utf-8") as file:
            for line, words in paragraphs(file.read()):
                if len(words) > MOST_WORDS:
                    print(f"{path}:{line}: a paragraph of {len(words)} words; {MOST_WORDS} are the most")
                    found += 1
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
