"""What the check sends to see each impairment alone, and what it concludes from what arrives."""
