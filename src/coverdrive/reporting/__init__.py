"""What a person looks at: figures and animations of bases, drives and studies."""
