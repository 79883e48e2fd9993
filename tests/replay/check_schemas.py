#!/usr/bin/env python3
"""Validates documents against JSON schemas (draft 2020-12) with python3-jsonschema.

  check_schemas.py CASES.json     a list of {"name", "schema", "document", "valid"}, the middle two names of files

Prints a line for each case that is other than it says. Exit status: 0 all are as they say, 1 some are not, 77 there is no
jsonschema.
"""
import json
import sys

try:
    from jsonschema import Draft202012Validator
except ImportError:
    print("python3-jsonschema is not installed")
    sys.exit(77)

validators = {}
wrong = 0
with open(sys.argv[1], encoding="utf-8") as file:
    cases = json.load(file)
for case in cases:
    if case["schema"] not in validators:
        with open(case["schema"], encoding="utf-8") as file:
            schema = json.load(file)
        Draft202012Validator.check_schema(schema)
        validators[case["schema"]] = Draft202012Validator(schema)
    with open(case["document"], encoding="utf-8") as file:
        document = json.load(file)
    errors = list(validators[case["schema"]].iter_errors(document))
    if (not errors) != case["valid"]:
        wrong += 1
        if case["valid"]:
            for error in errors[:5]:
                print(f"{case['name']}: /{'/'.join(map(str, error.absolute_path))}: {error.message[:300]}")
        else:
            print(f"{case['name']}: was accepted")
print(f"{len(cases)} documents, {wrong} other than they say")
sys.exit(1 if wrong else 0)
