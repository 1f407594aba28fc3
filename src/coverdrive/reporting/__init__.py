"""What was found goes in; out comes what a person looks at: page, figures, tables, pictures and videos of drives.

Door: `report`, `league`, `contents` and `claim`.
"""
