"""A run that can be rewound."""
